"""Small periodic plants: the variable-height inverted pendulum with its divergent component; Van der Pol."""
