/** The page of a spatial mechanism. */
import { SpaceDiagram } from "./space.js";
import { begin } from "./main.js";

begin(SpaceDiagram);
