/** The page of a mechanism of the plane. */
import { Diagram } from "./diagram.js";
import { begin } from "./main.js";

begin(Diagram);
