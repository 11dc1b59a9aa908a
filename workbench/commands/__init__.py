"""The commands, in the order `workbench --help` lists them. Each module imports its machinery inside the function."""

from collections.abc import Callable

from workbench.commands.analyse import analyse
from workbench.commands.compare import compare
from workbench.commands.design import design
from workbench.commands.export import export
from workbench.commands.forces import forces
from workbench.commands.model import model
from workbench.commands.motor import motor
from workbench.commands.new import new
from workbench.commands.problems import problems
from workbench.commands.propulsion import noise, propulsion
from workbench.commands.reproduce import reproduce
from workbench.commands.simulate import simulate
from workbench.commands.study import study
from workbench.commands.verify import verify

COMMANDS: list[Callable] = [
    problems,
    new,
    design,
    analyse,
    compare,
    model,
    simulate,
    forces,
    motor,
    propulsion,
    noise,
    reproduce,
    verify,
    export,
    study,
]
