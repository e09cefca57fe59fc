"""Why a frame's force does not count, by the format's names."""

REASONS = (
    "notMissingGRF",
    "measuredGrfZeroWhenAccelerationNonZero",
    "unmeasuredExternalForceDetected",
    "torqueDiscrepancy",
    "forceDiscrepancy",
    "notOverForcePlate",
    "missingImpact",
    "missingBlip",
    "shiftGRF",
    "interpolatedClippedGRF",
    "manualReview",
    "footContactDetectedButNoForce",
    "tooHighMarkerRMS",
    "hasInputOutliers",
    "hasNoForcePlateData",
    "velocitiesStillTooHighAfterFiltering",
    "copOutsideConvexFootError",
    "zeroForceFrame",
    "extendedToNearestPeakForce",
)  # a reason's place is its number

REVIEWED = "manualReview"  # a person decided; no other word is said
