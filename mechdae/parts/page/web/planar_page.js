/** The page of a mechanism of the plane. */
import { Diagram } from "./diagram.js";
import { Equations } from "./equations.js";
import { Balance } from "./balance.js";
import { Forces } from "./forces.js";
import { Plans } from "./plans.js";
import { Explain } from "./explain.js";
import { Overlays } from "./overlays.js";
import { begin } from "./main.js";

begin(Diagram, { Equations, Balance, Forces, Plans, Explain, Overlays });
