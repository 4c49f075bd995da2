"""The named effects a model may lack: one list for simulator, estimators and diagnosis."""
