"""The guideway: roughness spectra, the four types of irregularity, deterministic shapes, random realisations."""
