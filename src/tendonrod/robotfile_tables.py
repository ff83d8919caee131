"""The tables of a robot file as pydantic reads them: keys with units, types, no ranges; `robotfile` reads."""

from __future__ import annotations

from math import isfinite
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, PlainValidator, StrictStr


def _coordinate(value: Any) -> float | list[float]:
    each = value if isinstance(value, list) else [value]
    if not all(type(number) in (int, float) and isfinite(number) for number in each):
        raise ValueError
    return [float(number) for number in each] if isinstance(value, list) else float(value)


Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Coordinate = Annotated[float | list[float], PlainValidator(_coordinate)]


class Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class TubeTable(Table):
    inner_radius_mm: Number
    outer_radius_mm: Number
    length_mm: Number


class NotchesTable(Table):
    width_mm: Number
    spacing_mm: Number
    uncut_angle_deg: Number
    turns: Number


class FactorsTable(Table):
    axial: Number
    bending_x: Number
    bending_y: Number
    torsion: Number


class RodMaterialTable(Table):
    youngs_modulus_gpa: Number
    shear_modulus_gpa: Number
    density_kg_m3: Number


class TubeMaterialTable(RodMaterialTable):
    torsion: StrictStr = "published"
    stiffness_factors: FactorsTable | None = None


class RodTable(Table):
    length_mm: Number
    radius_mm: Number | None = None
    inner_radius_mm: Number | None = None
    area_mm2: Number | None = None
    ix_mm4: Number | None = None
    iy_mm4: Number | None = None
    j_mm4: Number | None = None
    precurvature_per_m: list[Number] = Field(default=[0.0, 0.0, 0.0], min_length=3, max_length=3)


class TaperedRodTable(Table):
    length_mm: Number
    base_radius_mm: Number
    tip_radius_mm: Number
    base_inner_radius_mm: Number | None = None
    tip_inner_radius_mm: Number | None = None
    precurvature_per_m: list[Number] = Field(default=[0.0, 0.0, 0.0], min_length=3, max_length=3)


class TendonTable(Table):
    routing: StrictStr
    radius_mm: Number | None = None
    x_mm: Coordinate | None = None
    y_mm: Coordinate | None = None
    offset_mm: Number | None = None
    angle_deg: Number | None = None
    turns: Number | None = None
    s_mm: list[Number] | None = None
    end_mm: Number | None = None
    friction: Number | None = None
    axial_stiffness_n: Number | None = None
    free_length_mm: Number | None = None
    wall: StrictStr | None = None


class TubeRobotTable(Table):
    name: StrictStr
    tube: TubeTable
    notches: NotchesTable
    material: TubeMaterialTable
    tendons: list[TendonTable] = []
    sources: dict[str, StrictStr] = {}


class RodRobotTable(Table):
    name: StrictStr
    rod: RodTable
    material: RodMaterialTable
    tendons: list[TendonTable] = []
    sources: dict[str, StrictStr] = {}


class TaperedRobotTable(Table):
    name: StrictStr
    tapered_rod: TaperedRodTable
    material: RodMaterialTable
    tendons: list[TendonTable] = []
    sources: dict[str, StrictStr] = {}


class SegmentsRobotTable(Table):
    name: StrictStr
    segments: list[dict[str, Any]]
    material: dict[str, Any] | None = None
    tendons: list[TendonTable] = []
    sources: dict[str, StrictStr] = {}


class TubeSegmentTable(Table):
    angle_deg: Number | None = None
    tube: TubeTable
    notches: NotchesTable
    material: TubeMaterialTable | None = None


class RodSegmentTable(Table):
    angle_deg: Number | None = None
    rod: RodTable
    material: RodMaterialTable | None = None


class TaperedSegmentTable(Table):
    angle_deg: Number | None = None
    tapered_rod: TaperedRodTable
    material: RodMaterialTable | None = None


ROBOTS = {
    "tube": TubeRobotTable,
    "rod": RodRobotTable,
    "tapered_rod": TaperedRobotTable,
    "segments": SegmentsRobotTable,
}
SEGMENTS = {"tube": TubeSegmentTable, "rod": RodSegmentTable, "tapered_rod": TaperedSegmentTable}
