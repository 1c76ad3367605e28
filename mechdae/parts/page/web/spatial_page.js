/** The page of a spatial mechanism. */
import { SpaceDiagram } from "./space.js";
import { Equations } from "./equations.js";
import { Plans } from "./plans.js";
import { Explain } from "./explain.js";
import { begin } from "./main.js";

begin(SpaceDiagram, { Equations, Plans, Explain });
