// Ends all servers and boards after every file of tests.

import { afterAll } from "vitest";
import { endAll } from "./children";

afterAll(endAll);
