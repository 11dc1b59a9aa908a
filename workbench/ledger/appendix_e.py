"""Appendix E, noise of the fan propulsion: our number for every number it prints that something else in it determines.

Rows in appendix_e.toml, dB(A) at 50 feet. The printed levels of one unit, of two fans and of two engines are taken as
given where a row sums them; the steps' reductions are those of `workbench.physics.propulsion.noise`.
"""

from workbench.physics.propulsion.noise import (
    BETTER_TREATMENT,
    CLEANER_INLET,
    CRUISE,
    FULL_POWER,
    QUIETER_SOURCE,
    energy_sum,
    noise_budget,
    of_units,
    report_sources,
)

FANS, ENGINES = 63.0, 68.0  # two fans, two engines with advanced technology (E.5)


def computed() -> dict[str, float]:
    """Row id → our number, in the unit of the row."""
    full_power = noise_budget(report_sources(fan_level=FULL_POWER, engine_level=FULL_POWER))
    cruise = noise_budget(report_sources())
    fans, engines = report_sources()
    printed_steps = (QUIETER_SOURCE, BETTER_TREATMENT)
    return {
        "E.5.full_power": full_power.overall,
        "E.5.cruise": cruise.overall,
        "E.5.engines": engines.level_after(printed_steps),
        "E.5.engine_reduction": CRUISE - (ENGINES - float(of_units(0.0, engines.units))),
        "E.5.fans": fans.level_after(printed_steps),
        "E.5.fans_with_clean_inlet": fans.level_after((*printed_steps, CLEANER_INLET)),
        "E.5.fan_reduction": CRUISE - (FANS - float(of_units(0.0, fans.units))),
        "E.5.advanced": float(energy_sum((FANS, ENGINES))),
    }
