"""Parts as solids of a STEP file, with true circles, by the geometry kernel Open CASCADE."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

import numpy as np

from mechdae.errors import UnavailableError
from mechdae.parts.exchange.workshop.cut import MM, PlacedPart, assembly
from mechdae.parts.exchange.workshop.outlines import NO_SIDE, Bend, Outline
from mechdae.tasks import ExportedMotion
from mechdae.types import Floats, Json


def step(motion: ExportedMotion, **given: float) -> dict[str, str]:
    """Return the assembly in its first pose, and the list of parts.

    Raises
    ------
    UnavailableError
        The kernel is not installed.
    """
    try:
        kernel = StepSolids()
    except ImportError:
        raise UnavailableError(
            "STEP files need the package cadquery-ocp-novtk", where="format",
            hint='pip install "mechdae[step]", or --format stl',
        ) from None  # fmt: skip
    parts, listing = assembly(motion, given)
    return {"": kernel.text(parts), "parts.csv": listing}


class StepSolids:
    """Solids of parts [mm]."""

    def __init__(self) -> None:
        self.a: Json = {}
        for module, names in MODULES.items():
            loaded = import_module(f"OCP.{module}")
            self.a |= {name: getattr(loaded, name) for name in names.split()}
        newer = ("Array1_gp_Pnt", "Array1_double", "Array1_int")
        before = ("TColgp_Array1OfPnt", "TColStd_Array1OfReal", "TColStd_Array1OfInteger")
        try:
            self.arrays = [getattr(import_module("OCP.collections"), name) for name in newer]
        except ImportError:  # before release 8
            modules = [import_module(f"OCP.{name.partition('_')[0]}") for name in before]
            self.arrays = [getattr(*pair) for pair in zip(modules, before, strict=True)]

    def text(self, parts: list[PlacedPart]) -> str:
        """Return a file of named solids, without the time at which it is written."""
        a = self.a
        a["Message"].DefaultMessenger_s().ChangePrinters().Clear()  # it would tell of each part
        document = a["TDocStd_Document"](a["TCollection_ExtendedString"]("mechdae"))
        tool = a["XCAFDoc_DocumentTool"].ShapeTool_s(document.Main())
        for part in parts:
            label = tool.AddShape(self.solid(part), False)
            a["TDataStd_Name"].Set_s(label, a["TCollection_ExtendedString"](part.part.name))
        writer = a["STEPCAFControl_Writer"]()
        writer.Transfer(document)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "parts.step"
            writer.Write(str(path))
            text = path.read_text(encoding="utf-8")
        return re.sub(r"'\d{4}-\d\d-\d\dT[\d:]+'", "''", text, count=1)

    def solid(self, placed: PlacedPart) -> object:
        """Return a part where it is."""
        a, part = self.a, placed.part
        face = a["BRepBuilderAPI_MakeFace"](self._wire(part.outline), True)
        for hole in part.holes:
            face.Add(self._wire(hole, reverse=True))
        tall = a["gp_Vec"](0.0, 0.0, (placed.high - placed.low) * MM)
        prism = a["BRepPrimAPI_MakePrism"](face.Face(), tall).Shape()
        turned, moved = a["gp_Trsf"](), a["gp_Trsf"]()
        turned.SetRotation(a["gp_Ax1"](a["gp_Pnt"](0.0, 0.0, 0.0), self._up), float(placed.turn))
        x, y = np.asarray(placed.place, float) * MM
        moved.SetTranslation(a["gp_Vec"](float(x), float(y), placed.low * MM))
        return a["BRepBuilderAPI_Transform"](prism, moved.Multiplied(turned), True).Shape()

    @property
    def _up(self) -> object:
        return self.a["gp_Dir"](0.0, 0.0, 1.0)

    def _wire(self, loop: Outline, reverse: bool = False) -> object:
        """Return a loop of arcs, curves and the straight sides between them."""
        a, sides, wire = self.a, loop.sides(), self.a["BRepBuilderAPI_MakeWire"]()
        edge, bends = a["BRepBuilderAPI_MakeEdge"], []
        for side, after in zip(sides, sides[1:] + sides[:1], strict=True):
            begin, end = self._point(side.begin), self._point(side.end)
            if isinstance(side, Bend):
                bends.append(side)
                if not isinstance(after, Bend):
                    wire.Add(edge(self._curve(bends)).Edge())
                    bends = []
            elif side.radius > 0:
                axes = a["gp_Ax2"](self._point(side.middle), self._up)
                wire.Add(edge(a["gp_Circ"](axes, side.radius * MM), begin, end).Edge())
            if np.hypot(*(after.begin - side.end)) > NO_SIDE * loop.radius:
                wire.Add(edge(end, self._point(after.begin)).Edge())
        found = wire.Wire()
        if reverse:
            found.Reverse()
        return found

    def _curve(self, bends: list[Bend]) -> object:
        """Return curves that go on in equal steps and directions as one spline."""
        inner = [place for bend in bends for place in (bend.first, bend.second)]
        places = [bends[0].begin, *inner, bends[-1].end]
        count = len(bends)
        poles, knots = [self._point(place) for place in places], np.arange(count + 1.0).tolist()
        values: list[Sequence[object]] = [poles, knots, [4, *[2] * (count - 1), 4]]
        arrays = []
        for make, several in zip(self.arrays, values, strict=True):
            arrays.append(make(1, len(several)))
            for k, value in enumerate(several):
                arrays[-1].SetValue(k + 1, value)
        return self.a["Geom_BSplineCurve"](*arrays, 3)

    def _point(self, place: Floats) -> object:
        return self.a["gp_Pnt"](float(place[0]) * MM, float(place[1]) * MM, 0.0)


MODULES = {
    "BRepBuilderAPI": "BRepBuilderAPI_MakeEdge BRepBuilderAPI_MakeFace BRepBuilderAPI_MakeWire "
    "BRepBuilderAPI_Transform",
    "BRepPrimAPI": "BRepPrimAPI_MakePrism",
    "Geom": "Geom_BSplineCurve",
    "Message": "Message",
    "STEPCAFControl": "STEPCAFControl_Writer",
    "TCollection": "TCollection_ExtendedString",
    "TDataStd": "TDataStd_Name",
    "TDocStd": "TDocStd_Document",
    "XCAFDoc": "XCAFDoc_DocumentTool",
    "gp": "gp_Ax1 gp_Ax2 gp_Circ gp_Dir gp_Pnt gp_Trsf gp_Vec",
}
