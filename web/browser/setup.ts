// For every file of tests: no server and no board is left running, whatever failed.

import { afterAll } from "vitest";
import { endAll } from "./children";

afterAll(endAll);
