// Past recordings.

import { api } from "../api";
import { element, need } from "../dom";
import type { RecordingInfo, SessionInfo } from "../protocol";
import { begun, bytes, seconds } from "../words";

/** Requests and lists the recordings in the server's order, newest first. */
export async function listRecordings(session: SessionInfo, replay: (name: string) => void): Promise<void> {
  const note = need("recordings-note");
  if (session.recording === null) {
    note.textContent = "Recordings need a folder: palpate serve … --record DIR.";
    need("recordings").replaceChildren();
    return;
  }
  const all = (await api.recordings()).filter((recording) => recording.name !== session.recording?.name);
  note.textContent = all.length === 0 ? `None in ${session.recording.folder} yet.` : `In ${session.recording.folder}:`;
  need("recordings").replaceChildren(...all.map((recording) => item(recording, replay)));
}

function item(recording: RecordingInfo, replay: (name: string) => void): HTMLLIElement {
  const button = element("button", "", "Replay");
  button.type = "button";
  button.setAttribute("aria-label", `Replay ${recording.name}`);
  button.addEventListener("click", () => replay(recording.name));
  const file = element("a", "", "MCAP");
  file.href = api.recordingFile(recording.name);
  file.download = "";
  file.setAttribute("aria-label", `Download ${recording.name}`);
  const facts = `${begun(recording.start_s)}, ${seconds(recording.seconds)}, ${recording.readings.toLocaleString("en-GB")} readings, ${bytes(recording.bytes)}`;
  const words = element("div", "", element("div", "name", recording.name), element("div", "quiet", facts));
  return element("li", "recording", words, element("div", "row", button, file));
}
