"""Scene to machine: the chain, with what friction in its joints asks of the crank."""

from __future__ import annotations

from flywheel.chain import FLYWHEEL, FRICTION, Chain, merged
from flywheel.scene import Scene

__all__ = ["FLYWHEEL", "FRICTION", "Machine", "merged"]


class Machine(Chain):
    """A machine of one degree of freedom: its scene, its bond graph, and the crank angles that it breaks at.

    It is the `Chain` of the scene's transmissions; where joints of a linkage rub, with the moment of their friction on the
    crank (`friction`), found once by kinetostatics at the scene's constant speed.
    """

    def __init__(self, scene: Scene) -> None:
        friction = None
        if isinstance(scene, Scene) and scene.rubs:
            from flywheel.joint_friction import friction_curve  # only scenes with rough joints pay for it

            friction = friction_curve(scene)
        super().__init__(scene, friction)
        self.friction = friction
