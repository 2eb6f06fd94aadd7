"""The gait that suits a robot and an aim: searched on steady motions, confirmed by simulation."""
