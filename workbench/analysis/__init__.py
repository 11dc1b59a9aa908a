"""What a closed loop does: roots, margins, responses, spectra, ride comfort, control power."""
