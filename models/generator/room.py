"""The environment: a free-standing desk in a furnished room."""

from . import room_shell
from .mesh import Model


def build():
    model = Model("room_desk")
    room_shell.add_desk(model)
    room_shell.add_shell(model)
    room_shell.add_lights(model)
    model.texts["environment.yaml"] = room_shell.environment_yaml()
    return model
