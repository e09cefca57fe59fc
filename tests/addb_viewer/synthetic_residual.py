"""A residual as `diagnose --json` has it, with figures of our own making."""


def size(force=41.0, moment=20.0, force_floor=10.0, moment_floor=5.0, seconds=4.0):
    return {
        "seconds": seconds,
        "force_N": force,
        "force_floor_N": force_floor,
        "moment_Nm": moment,
        "moment_floor_Nm": moment_floor,
    }


def trial(name, frames, time_history=None, **worst):
    nothing = {"time_s": [], "force_N": [], "force_after_N": [], "force_floor_N": []}
    nothing |= {"moment_Nm": [], "moment_after_Nm": [], "moment_floor_Nm": []}
    return {
        "trial": name,
        **size(),
        "worst": {"frames": list(frames), **size(seconds=0.5, **worst)},
        "time_history": time_history or nothing,
    }


def residual(*trials, phases=(), mean_force_N=(1.0, 30.0, 2.0), **whole):
    sizes = (size(8.0, 2.0), size(40.0, 2.0), size(3.0, 15.0))
    return {
        **size(**whole),
        "phases": [{"phase": phase, "foot": foot, **of} for phase, foot, of in phases],
        "axes": [
            {"axis": axis, "direction": direction, "mean_force_N": mean, **of}
            for axis, direction, mean, of in zip(
                "xyz", ("forward", "vertical", "sideways"), mean_force_N, sizes, strict=True
            )
        ],
        "trials": list(trials),
    }
