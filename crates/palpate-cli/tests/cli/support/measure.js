// Runs inside a page, in an inner frame, and leaves what it measured in the outer page.
(() => {
  const errors = [];
  addEventListener("error", (event) => {
    if (event.message) errors.push(`${event.message} (line ${event.lineno})`);
  });
  addEventListener("unhandledrejection", (event) => errors.push(`unhandled: ${event.reason}`));
  const logged = console.error;
  console.error = (...what) => { errors.push(what.join(" ")); logged(...what); };

  const outside = /^\s*(https?:)?\/\//i;
  const head = (element) => element.outerHTML.slice(0, 120);
  const isShown = (element) => getComputedStyle(element).display !== "none";
  const every = (selector) => Array.from(document.querySelectorAll(selector));
  const reference = (element, name) => element.getAttribute(name) ?? element.getAttributeNS("http://www.w3.org/1999/xlink", name) ?? "";

  const isEmpty = (element) => {
    const box = element.getBoundingClientRect();
    const unloaded = element.localName === "img" && element.naturalWidth === 0;
    return unloaded || box.width === 0 || box.height === 0;
  };
  const loadsFromOutside = (element) => ["src", "srcset", "poster", "data"].some((name) => outside.test(reference(element, name)))
    || (element.localName !== "a" && outside.test(reference(element, "href")));
  const styleLoadsFromOutside = (text) => /(url\(\s*['"]?|@import\s+['"])\s*(https?:)?\/\//i.test(text);
  const isDead = (anchor) => {
    const target = anchor.getAttribute("href").slice(1);
    const name = (() => { try { return decodeURIComponent(target); } catch { return target; } })();
    return name !== "" && name !== "top" && !document.getElementById(name) && document.getElementsByName(name).length === 0;
  };

  const measure = () => ({
    errors,
    width: document.documentElement.clientWidth,
    content_width: document.documentElement.scrollWidth,
    // A figure may hold its picture for a phone too; it shows one of the two.
    empty_pictures: every("img, svg").filter((it) => !it.parentElement.closest("svg") && isShown(it) && isEmpty(it))
      .concat(every("figure:has(svg)").filter((it) => Array.from(it.querySelectorAll(":scope > svg")).filter(isShown).length !== 1))
      .map(head),
    outside_loads: [
      ...every("*").filter(loadsFromOutside).map(head),
      ...every("style").filter((it) => styleLoadsFromOutside(it.textContent)).map(head),
      ...every("[style]").filter((it) => styleLoadsFromOutside(it.getAttribute("style"))).map(head),
    ],
    outside_links: every("a[href]").filter((it) => outside.test(reference(it, "href"))).map((it) => reference(it, "href")),
    dead_anchors: every("a[href^='#']").filter(isDead).map((it) => it.getAttribute("href")),
  });
  addEventListener("load", () => setTimeout(() => {
    const result = parent.document.createElement("pre");
    result.id = "palpate-measured";
    result.textContent = JSON.stringify(measure()).replace(/[<>&\u00a0]/g, (it) => "\\u" + it.charCodeAt(0).toString(16).padStart(4, "0"));
    parent.document.body.append(result);
  }, 200));
})();
