"""A bench in a few lines: axes that do what they are told, and a tendon that is a spring between z and x_t."""

from dataclasses import dataclass, field

from tendonrod.rig.interfaces import AxisState, Command, Force, Sample


@dataclass
class SmallPlant:
    """tau = max(0, (pay z - x_t + slack) / compliance); pay, without unit: tendon that a translation needs."""

    compliance: float = 3.3e-3
    pay: float = 0.974
    slack: float = 0.0
    z: float = 0.0
    x: float = 0.0
    phi: float = 0.0
    time: float = 0.0
    velocities: tuple = (0.0, 0.0, 0.0)
    is_broken: bool = False
    trace: list = field(default_factory=list)

    @property
    def tension(self) -> float:
        return 0.0 if self.is_broken else max(0.0, (self.pay * self.z - self.x + self.slack) / self.compliance)

    def sample(self) -> Sample:
        states = [
            AxisState(time=self.time, position=position, velocity=velocity)
            for position, velocity in zip((self.x, self.z, self.phi), self.velocities, strict=True)
        ]
        force = Force(time=self.time, tension=self.tension)
        return Sample(time=self.time, screw=states[0], translation=states[1], rotation=states[2], force=force)

    def move(self, command: Command, dt: float) -> None:
        self.velocities = command.screw, command.translation, command.rotation
        self.x, self.z, self.phi = (
            at + v * dt for at, v in zip((self.x, self.z, self.phi), self.velocities, strict=True)
        )
        self.time += dt

    def run(self, task, seconds: float, rate: float = 200.0) -> "SmallPlant":
        """Ask ``task`` until it is done; trace: (sample, command, phase)."""
        dt = 1.0 / rate
        while not task.is_done and self.time < seconds:
            sample, phase = self.sample(), task.phase
            command = task.update(sample, dt)
            self.trace.append((sample, command, phase))
            self.move(command, dt)
        return self
