// A page that is opened from a disk cannot start a worker. A hidden frame runs the site's search instead.
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    #inner = null;
    #waiting = [];

    constructor(url) {
      super();
      const frame = document.createElement("iframe");
      frame.hidden = true;
      frame.srcdoc = "<!doctype html><body></body>";
      frame.addEventListener("load", () => this.#start(frame.contentWindow, new URL(url, location.href).href), { once: true });
      document.body.append(frame);
    }

    postMessage(data) {
      if (this.#inner) {
        this.#inner.dispatchEvent(new this.#inner.MessageEvent("message", { data }));
      } else {
        this.#waiting.push(data);
      }
    }

    #start(inner, url) {
      inner.postMessage = (data) => this.dispatchEvent(new MessageEvent("message", { data }));
      const script = inner.document.createElement("script");
      script.src = url;
      script.addEventListener("load", () => {
        this.#inner = inner;
        this.#waiting.splice(0).forEach((data) => this.postMessage(data));
      });
      inner.document.body.append(script);
    }
  };
}
