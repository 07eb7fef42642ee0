"""Free flight of a ring that spins and vibrates."""

from scene_tools import DECKS

from .common import Chapter, drift, size, table


def start(runs):
    deck = DECKS / "spinning_ring.inp"
    return {h: runs.start(deck, h=h, t_end=1000*h, frame=500*h) for h in (0.1, 0.05, 0.01)}


def report(started, _):
    rows = []
    for h, future in started.items():
        run = future.result()
        history = run.history
        rows.append(
            (
                f"{h:g}",
                *(size(drift(history[name])) for name in ("total", "px", "py", "lz")),
                f"{history['strain'].max()/history['total'][0]:.2f}",
                f"{history['newton'][1:].mean():.1f}",
                int(history["cuts"].sum()),
            )
        )
    return table(
        ["h", "energy", "px", "py", "lz", "largest strain energy / total", "Newton", "cuts"], rows
    )


CHAPTERS = [Chapter("spin", start, report)]
