"""The Diagnosis tab: verdict, causes, decision."""
