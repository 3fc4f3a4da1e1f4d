"""The environment: a free-standing desk in a furnished room."""

from . import room_furniture, room_shell, room_walls
from .mesh import Model


def build():
    model = Model("room_desk")
    room_furniture.add_materials(model)
    room_shell.add_desk(model)
    room_shell.add_shell(model)
    room_shell.add_lights(model)
    room_walls.add_trim(model)
    room_walls.add_pictures(model)
    room_walls.add_boards(model)
    room_walls.add_window(model)
    room_walls.add_door(model)
    room_furniture.add_bookcase(model)
    room_furniture.add_cabinet(model)
    room_furniture.add_wall_shelf(model)
    room_furniture.add_floor_things(model)
    room_furniture.add_chair(model)
    room_furniture.add_boxes(model)
    room_furniture.add_ceiling(model)
    model.texts["environment.yaml"] = room_shell.environment_yaml()
    return model
