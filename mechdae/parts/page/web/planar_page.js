/** The page of a mechanism of the plane. */
import { Diagram } from "./diagram.js";
import { Equations } from "./equations.js";
import { Plans } from "./plans.js";
import { Explain } from "./explain.js";
import { Overlays } from "./overlays.js";
import { begin } from "./main.js";

begin(Diagram, { Equations, Plans, Explain, Overlays });
