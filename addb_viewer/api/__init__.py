"""The Python interface: `Subject`, `Fit`, `Diagnosis`, and the arrays that they give."""
