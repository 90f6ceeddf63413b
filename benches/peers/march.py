"""The load path, the same for every package: the path states in order, halved steps where Newton's method fails."""

import resource
import time

import numpy as np

# A step that needs more is halved.
MAX_ITERATIONS = 12
# A step is halved at most this often.
MAX_HALVINGS = 12


class NotConverged(Exception):
    """Newton's method failed; the message says how."""


def cpu_seconds():
    """User and system time of this process."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


class Criterion:
    """Salp's own: the largest free nodal force against the largest reaction or pressure force, at least a tenth of the
    schedule's largest."""

    def __init__(self, case):
        self.tolerance = case.tolerance
        self.full = case.largest_nodal_force()
        self.peak = abs(case.states).max()
        self.no_load = case.states[0]
        self.scale = 0.1 * self.full

    def load(self, pressures):
        self.scale = self.full * max(0.1, abs(pressures).max() / self.peak)

    def met(self, free, reactions):
        """Residual forces at free and at held unknowns."""
        largest = abs(free).max()
        if not np.isfinite(largest):
            raise NotConverged("a residual that is not finite")
        return largest <= self.tolerance * max(self.scale, abs(reactions).max())


def march(peer, case):
    """Solves all states; answers displacements of the probes, counts and CPU seconds."""
    reached = case.states[0]
    path = [{name: [0.0, 0.0] for name in case.probes}]
    newton = inserted = failed = 0
    started, wall = cpu_seconds(), time.monotonic()
    step = 1.0
    for target in case.states[1:]:
        origin, done = reached, 0.0
        while done < 1.0:
            ahead = min(1.0, done + step)
            if ahead > 1.0 - 1e-9:
                ahead = 1.0
            kept = peer.save()
            try:
                newton += peer.solve(origin + ahead * (target - origin))
            except NotConverged as why:
                failed += 1
                newton += MAX_ITERATIONS
                peer.restore(kept)
                step /= 2
                if step < 0.5**MAX_HALVINGS:
                    raise NotConverged(f"at {origin + done * (target - origin)} MPa: {why}") from why
                continue
            inserted += ahead < 1.0
            done = ahead
            step = min(1.0, 2 * step)
        reached = target
        path.append({name: [float(u) for u in peer.displacement(probe)] for name, probe in case.probes.items()})
    return {
        "path": path,
        "newton_iterations": newton,
        "inserted_states": int(inserted),
        "failed_steps": failed,
        "cpu_s": cpu_seconds() - started,
        "wall_s": time.monotonic() - wall,
    }
