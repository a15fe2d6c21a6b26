"""The referee: metrics, scores against truth and the regression gate. Closed to the estimator."""
