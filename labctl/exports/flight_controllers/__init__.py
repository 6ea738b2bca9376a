"""Parameters of flight controllers: the bias of a gyro over temperature."""
