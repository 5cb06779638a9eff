"""The contact FMU as a force inside an engine of one's own: set penetration and velocity, step, read the force.

Copy this file; it needs fmpy and nothing else of touchdown."""

import shutil

import fmpy
from fmpy.fmi2 import FMU2Slave


class Contact:
    """One contact. `force(x, v, h)` takes the body's penetration and velocity at the end of a macro-step h."""

    def __init__(self, path, **start):
        description = fmpy.read_model_description(path)
        self.reference = {v.name: v.valueReference for v in description.modelVariables}
        self.folder = fmpy.extract(path)
        self.fmu = FMU2Slave(
            guid=description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="contact",
        )
        self.fmu.instantiate()
        for name, value in start.items():
            self.fmu.setReal([self.reference[name]], [value])
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()
        self.steps = 0
        self.inputs = [self.reference["penetration"], self.reference["velocity"]]

    def force(self, x, v, h):
        """Force, N, to apply over the macro-step that comes."""
        self.fmu.setReal(self.inputs, [x, v])
        self.fmu.doStep(self.steps * h, h)
        self.steps += 1
        return self.get("force")

    def get(self, name):
        return self.fmu.getReal([self.reference[name]])[0]

    def close(self):
        self.fmu.terminate()
        self.fmu.freeInstance()
        shutil.rmtree(self.folder, ignore_errors=True)
