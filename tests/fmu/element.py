"""The packed FMU as tests see it: by name, with statuses, and with everything it logged."""

import ctypes
import shutil

import fmpy
from fmpy import fmi2

OK, DISCARD, ERROR = 0, 2, 3

# Golden impacts of 1 kg at 1 m/s: k, p, mu_d; deepest m, restitution, duration s, peak N. From the exact phase curve
# of m x'' = -x^p (k + mu v), evaluated to 40 digits.
GOLDEN = [
    (3.51e10, 2.79, 2.70e10, 1.7588165601242512e-3, 0.65712174496578164, 5.8181339632048352e-3, 813.04615987599714),
    (1.85e8, 1.96, 8.77e7, 1.6803097731131710e-3, 0.75847045292087518, 5.4497898388347824e-3, 716.04884002798315),
]


class Element:
    """An instance of the element in fmpy."""

    def __init__(self, path, start=None, initialize=True, guid=None, logging=False):
        self.description = fmpy.read_model_description(path)
        self.vr = {v.name: v.valueReference for v in self.description.modelVariables}
        self.kind = {v.name: v.type for v in self.description.modelVariables}
        self.folder = fmpy.extract(path)
        self.log = []
        self.callbacks = fmi2.fmi2CallbackFunctions()
        self.callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(self._logged)
        self.callbacks.allocateMemory = fmi2.defaultCallbacks.allocateMemory
        self.callbacks.freeMemory = fmi2.defaultCallbacks.freeMemory
        self.fmu = fmi2.FMU2Slave(
            guid=guid or self.description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName="contact",
        )
        self.fmu.instantiate(callbacks=self.callbacks, loggingOn=logging)
        self.time = 0.0
        for name, value in (start or {}).items():
            self.set(name, value)
        if initialize:
            self.fmu.setupExperiment(startTime=0.0)
            self.fmu.enterInitializationMode()
            self.fmu.exitInitializationMode()

    def _logged(self, environment, name, status, category, message):
        self.log.append((status, category.decode(), message.decode()))

    @property
    def component(self):
        return self.fmu.component

    @property
    def dll(self):
        """The library without the argument types that fmpy holds calls to."""
        return ctypes.CDLL(f"{self.folder}/binaries/linux64/HysteresisContact.so")

    def set(self, name, value):
        if self.kind[name] == "Enumeration":
            self.fmu.setInteger([self.vr[name]], [value])
        else:
            self.fmu.setReal([self.vr[name]], [value])

    def get(self, name):
        if self.kind[name] == "Boolean":
            return self.fmu.getBoolean([self.vr[name]])[0]
        return self.fmu.getReal([self.vr[name]])[0]

    def move(self, x, v):
        self.fmu.setReal([self.vr["penetration"], self.vr["velocity"]], [x, v])

    def force(self, x, v):
        self.move(x, v)
        return self.get("force")

    def step(self, h):
        self.fmu.doStep(self.time, h)
        self.time += h

    def status(self, function, *arguments):
        """Status of a raw call, whatever it is."""
        f = getattr(self.dll, function)
        f.restype = ctypes.c_int
        return f(ctypes.c_void_p(self.component), *arguments)

    def set_status(self, name, value):
        reference, number = (ctypes.c_uint * 1)(self.vr[name]), (ctypes.c_double * 1)(value)
        return self.status("fmi2SetReal", reference, ctypes.c_size_t(1), number)

    def get_status(self, name):
        reference, number = (ctypes.c_uint * 1)(self.vr[name]), (ctypes.c_double * 1)()
        return self.status("fmi2GetReal", reference, ctypes.c_size_t(1), number)

    def step_status(self, time, h):
        return self.status("fmi2DoStep", ctypes.c_double(time), ctypes.c_double(h), ctypes.c_int(1))

    def close(self):
        self.fmu.freeInstance()
        shutil.rmtree(self.folder, ignore_errors=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
