"""Ranges of the numbers of random worlds and missions."""

from __future__ import annotations

from collections.abc import Mapping

NUMBERS: Mapping[str, Mapping[str, tuple[float, float]]] = {
    "robot.slip": {
        "distance_percent": (-10, 40),
        "turn_percent": (-10, 40),
        "veer_deg_per_m": (-40, 40),
        "jitter_percent": (0, 30),
    },
    "robot": {
        "radius_mm": (60, 220),
        "wheel_diameter_mm": (30, 90),
        "track_mm": (60, 220),
        "mass_kg": (0.2, 3),
        "grip": (0.05, 1.5),
        "motor_mismatch_percent": (-30, 30),
        "battery_mv": (5000, 10000),
        "battery_ohm": (0, 3),
        "battery_drain_mv_per_min": (0, 1000),
        "dead_zone_percent": (0, 30),
        "backlash_deg": (0, 40),
    },
    "camera": {
        "hfov_deg": (25, 110),
        "height_mm": (60, 400),
        "forward_mm": (-80, 120),
        "right_mm": (-150, 150),
        "yaw_deg": (-40, 40),
        "tilt_deg": (-15, 15),
        "roll_deg": (-30, 30),
        "fps": (1, 60),
        "latency_s": (0, 2),
        "drop_rate": (0, 0.95),
        "distortion_k1": (-0.2, 0.2),
        "readout_s": (0, 0.2),
        "shutter_s": (0, 0.2),
        "auto_exposure_s": (0, 10),
    },
    "computer": {"look_s": (0, 2)},
    "ultrasonic": {
        "forward_mm": (-50, 150),
        "height_mm": (30, 300),
        "noise_mm": (0, 200),
        "dropout": (0, 1),
        "max_incidence_deg": (5, 90),
    },
    "light": {"exposure": (0.05, 4), "ambient_percent": (0, 100), "drift_percent": (0, 95), "drift_s": (0.1, 100)},
    "surroundings": {"sound_db": (0, 120), "temperature_c": (-20, 60), "north_deg": (0, 360)},
}
"""Ranges of a world's numbers, by table; most are wider than those of docs/reality.md."""
INTEGERS = frozenset({"battery_mv", "dead_zone_percent", "fps", "advances", "max_researches", "rounds", "repeats"})
MISSION_NUMBERS: Mapping[str, Mapping[str, tuple[float, float]]] = {
    "thesis": {
        "wait_s": (0, 60),
        "turn_deg": (-360, 360),
        "advances": (1, 20),
        "advance_mm": (10, 800),
        "max_researches": (0, 6),
        "look_every_deg": (5, 180),
        "settle_s": (0, 2),
        "continue_every_s": (0.5, 60),
        "lost_after_s": (0.2, 10),
        "approach_limit_s": (1, 90),
        "cruise_mm_s": (20, 400),
    },
    "adaptive": {
        "cruise_mm_s": (70, 400),
        "travel_share": (1, 3),
        "scan_deg_s": (5, 120),
        "lost_after_s": (0.2, 10),
        "approach_limit_s": (1, 90),
        "sonar_tolerance_mm": (50, 2000),
        "search_budget_s": (1, 300),
        "rounds": (1, 6),
        "max_researches": (0, 6),
        "repeats": (1, 2),
        "fixed_wait_s": (0, 30),
    },
}
SWITCHES = ("detours", "chooses_viewpoints", "remembers_others", "sees_floor", "in_order")
BELIEVED: Mapping[str, Mapping[str, tuple[float, float]]] = {
    "robot": {"turn_slip_percent": (-5, 20), "stop_distance_mm": (60, 400), "wheel_mismatch_percent": (-5, 5)},
    "camera": {"hfov_deg": (40, 90), "forward_mm": (-50, 100), "latency_s": (0, 1)},
}
"""Values of a mission that does not describe the robot as it is."""
