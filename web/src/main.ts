// The dashboard of `palpate serve`.

import "uplot/dist/uPlot.min.css";
import { Page } from "./page";
import { openStream } from "./stream";
import { startTheme } from "./view/theme";

startTheme();
const page = new Page();
page.start();
openStream(
  (message) => page.take(message),
  (connection) => page.connected(connection),
);
