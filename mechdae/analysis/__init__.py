"""Assembly, modes, sweeps: from kernels to results."""
