"""What the paper prints, and nothing computed. Moradkhani et al., "Helical Tendon-Driven Continuum Robot with
Programmable Follow-the-Leader Operation"; each number with its place there. SI units, but Table I in mm as printed."""

from __future__ import annotations

from types import MappingProxyType

PROTOTYPES = ("exonav-1", "exonav-2", "exonav-3", "exonav-4")  # section II: prototypes 1 to 4

GRAVITY = (-9.81, 0.0, 0.0)  # m/s2, II-D: towards -X0, g = 9.81 m/s2
TARGET_TENSIONS = (0.2, 0.45, 0.7)  # N, tau_des in II-C and Fig. 4
MEASURED_AT = (0.25, 0.5, 0.75, 1.0)  # s / L_na of the tracker, III-B and Table I
LARGEST_TENSION = 0.7  # N, the largest tension that the paper names

FTL_POLYNOMIAL = (
    0.6492,
    -0.5159,
    0.6088,
)  # N, tau_FTL(eta) for tau_des = 0.7 N, III-C and Fig. 8(a); highest power first
FTL_TIP_RMSE_SIMULATED = 1.0706e-3  # m, III-C, Fig. 8(c)
FTL_TIP_RMSE_TRIALS = (3.6433e-3, 3.6288e-3, 3.7481e-3)  # m, trials 1 to 3, III-C, Fig. 8(c)

# Table I, "prediction errors with and without modeling gravity", RMSE in mm at s = 1/4, 1/2, 3/4, 1 of L_na.
RMSE_WITH_GRAVITY_MM = MappingProxyType({
    "exonav-1": (2.48, 1.90, 1.40, 1.76),
    "exonav-2": (1.18, 1.19, 1.22, 2.33),
    "exonav-3": (0.44, 0.76, 1.41, 2.18),
    "exonav-4": (0.26, 1.63, 1.29, 1.33),
})  # fmt: skip
RMSE_WITHOUT_GRAVITY_MM = MappingProxyType({
    "exonav-1": (1.67, 1.43, 2.16, 4.18),
    "exonav-2": (0.87, 1.51, 2.69, 3.30),
    "exonav-3": (3.15, 5.67, 6.95, 9.60),
    "exonav-4": (2.81, 3.09, 3.61, 5.61),
})  # fmt: skip
