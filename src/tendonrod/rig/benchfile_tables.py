"""The tables of a bench file: keys with units, types, no ranges; `benchfile` reads them."""

from __future__ import annotations

from typing import Any

from ..robotfile_tables import Number, Table


class BenchTable(Table, strict=True):
    """Nothing is taken for another type than it is written in."""


class VirtualBenchTable(BenchTable):
    kind: str
    gravity_m_s2: list[Number] | None = None
    tracker: bool = True
    mechanics: str | None = None
    command_timeout_ms: Number | None = None
    highest_tension_n: Number | None = None


class TendonTable(BenchTable):
    stiffness_n: Number | None = None
    length_mm: Number | None = None
    friction: Number | None = None
    slack_mm: Number | None = None


class OuterTubeTable(BenchTable):
    friction_n: Number | None = None
    tilt_deg: list[Number] | None = None


class LinearTable(BenchTable):
    speed_mm_s: Number | None = None
    acceleration_mm_s2: Number | None = None
    braking_mm_s2: Number | None = None
    backlash_mm: Number | None = None
    pressed: str | None = None
    resolution_mm: Number | None = None
    home_error_mm: Number | None = None
    low_mm: Number | None = None
    high_mm: Number | None = None
    start_mm: Number | None = None


class RotaryTable(BenchTable):
    speed_deg_s: Number | None = None
    acceleration_deg_s2: Number | None = None
    braking_deg_s2: Number | None = None
    backlash_deg: Number | None = None
    pressed: str | None = None
    resolution_deg: Number | None = None
    home_error_deg: Number | None = None
    low_deg: Number | None = None
    high_deg: Number | None = None
    start_deg: Number | None = None


class VirtualCellTable(BenchTable):
    full_scale_n: Number | None = None
    noise_mn: Number | None = None
    drift_mn_per_sqrt_s: Number | None = None
    zero_mn: Number | None = None
    scale: Number | None = None
    resolution_mn: Number | None = None
    bandwidth_hz: Number | None = None
    rate_hz: Number | None = None


class FieldTable(BenchTable):
    position_mm: list[Number] | None = None
    rotation_deg: list[Number] | None = None


class VirtualTrackerTable(BenchTable):
    name: str | None = None
    rate_hz: Number | None = None
    position_noise_mm: Number | None = None
    orientation_noise_deg: Number | None = None
    delay_ms: list[Number] | None = None
    burst_rate_hz: Number | None = None
    burst_length_ms: Number | None = None
    mass_g: Number | None = None
    offset_mm: list[Number] | None = None
    turn_deg: list[Number] | None = None
    quality_mm: Number | None = None


class FaultTable(BenchTable):
    kind: str
    time_s: Number
    duration_s: Number | None = None
    where: str | None = None
    value_n: Number | None = None
    value_mm: Number | None = None
    value_deg: Number | None = None
    value_mm_s: Number | None = None
    value_deg_s: Number | None = None
    value_ms: Number | None = None


class LimitsTable(BenchTable):
    tension_n: Number | None = None
    soft: Number | None = None
    slack_n: Number | None = None
    tension_rate_n_s: Number | None = None
    rate_window_ms: Number | None = None
    lost_pull_mm: Number | None = None
    take_up_mm: Number | None = None
    strain: Number | None = None
    sensor_age_ms: Number | None = None
    tracker_time_ms: Number | None = None
    stall_time_ms: Number | None = None
    command_timeout_ms: Number | None = None
    late_share: Number | None = None
    late_in_row: int | None = None
    release_rate_mm_s: Number | None = None
    release_travel_mm: Number | None = None
    patience_s: Number | None = None
    screw_travel_mm: list[Number] | None = None
    screw_speed_mm_s: Number | None = None
    translation_travel_mm: list[Number] | None = None
    translation_speed_mm_s: Number | None = None
    rotation_travel_deg: list[Number] | None = None
    rotation_speed_deg_s: Number | None = None


class VirtualFile(BenchTable):
    bench: VirtualBenchTable
    tendon: TendonTable = TendonTable()
    outer_tube: OuterTubeTable = OuterTubeTable()
    screw: LinearTable = LinearTable()
    translation: LinearTable = LinearTable()
    rotation: RotaryTable = RotaryTable()
    load_cell: VirtualCellTable = VirtualCellTable()
    tracker: VirtualTrackerTable = VirtualTrackerTable()
    field: FieldTable | None = None
    fault: list[FaultTable] | None = None
    limits: LimitsTable = LimitsTable()


class DeviceBenchTable(BenchTable):
    kind: str
    gravity_m_s2: list[Number] | None = None


class LaunchPadTable(BenchTable):
    port: str
    baud: int | None = None
    timeout_ms: Number | None = None
    tries: int | None = None
    max_age_ms: Number | None = None


class DeviceCellTable(BenchTable):
    counts_per_newton: Number
    zero_counts: Number
    full_scale_n: Number
    tare_readings: int = 0


class AuroraTable(BenchTable):
    port: str
    rate_hz: Number | None = None
    delay_ms: Number | None = None
    largest_error_mm: Number | None = None
    limit_ms: Number | None = None
    setup_limit_ms: Number | None = None
    baud: int | None = None


class ToolTable(BenchTable):
    name: str
    rom: str | None = None
    on: str | None = None
    at_mm: Number | None = None
    point_mm: list[Number] | None = None
    offset_mm: list[Number] | None = None
    turn_deg: list[Number] | None = None
    mass_g: Number | None = None


class DeviceFile(BenchTable):
    bench: DeviceBenchTable
    launchpad: LaunchPadTable
    load_cell: DeviceCellTable
    aurora: AuroraTable | None = None
    tool: list[ToolTable] | None = None
    field: FieldTable | None = None
    limits: LimitsTable = LimitsTable()


KINDS: dict[str, Any] = {"virtual": VirtualFile, "devices": DeviceFile}
