"""What the AddBiomechanics Dataset paper says of its own release, for comparison (Werling et al. 2024)."""

from dataclasses import dataclass


@dataclass(frozen=True)
class PaperSource:
    """A row of the paper's table 1."""

    source: str
    subjects: int
    total_hours: float
    grf_hours: float


PAPER_SOURCES = (
    PaperSource("Lencioni et al. 2019", 50, 0.52, 0.37),
    PaperSource("Carter et al. 2023", 50, 21.60, 19.80),
    PaperSource("Santos et al. 2017", 49, 4.90, 4.90),
    PaperSource("Camargo et al. 2021", 22, 19.87, 10.10),
    PaperSource("Tan et al. 2023", 17, 4.40, 4.40),
    PaperSource("Moore et al. 2015", 12, 6.22, 6.03),
    PaperSource("Falisse et al. 2016", 11, 0.49, 0.10),
    PaperSource("Hamner et al. 2013", 10, 0.02, 0.02),
    PaperSource("Van der Zee et al. 2022", 10, 5.46, 5.31),
    PaperSource("Uhlrich et al. 2023", 10, 0.24, 0.05),
    PaperSource("Tan et al. 2022", 9, 3.73, 3.73),
    PaperSource("Wang et al. 2023", 9, 1.84, 1.84),
    PaperSource("Han et al. 2023", 7, 1.70, 0.52),
    PaperSource("Fregly et al. 2012", 6, 0.14, 0.04),
    PaperSource("Li et al. 2021", 1, 0.34, 0.34),
)
PAPER_SUM = PaperSource("Sum", 273, 71.47, 57.55)  # as the paper prints it

CLINICAL_HOURS, CLINICAL_PERCENT_IN_TEXT = 12.1, 21.2
SUPPORT_PERCENT = {"single support": 53.4, "double support": 21.2, "flight": 25.4}
MARKER_CM, LINEAR_BW, ANGULAR_BWH = (2.17, 2.44), (0.046, 0.027), (0.11, 0.02)  # mean, SD


def clinical_percent() -> float:
    """What the paper's clinical hours are of its hours with forces [%]; its text says otherwise."""
    return 100 * CLINICAL_HOURS / PAPER_SUM.grf_hours
