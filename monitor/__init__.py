"""THE WATCH: many windows over months -> history, drift, alerts."""
