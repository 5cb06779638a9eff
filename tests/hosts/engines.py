"""A body of one degree of freedom in three multibody engines, its contact our FMU.

Each function takes the contact, the mass (kg), the start (m, m/s), what drives the body (`drive(t, x, v)`, N), the
macro-step (s) and the time (s), and calls `seen(t, x, v)` at every communication point; it stops where `seen` answers
False. Contact and drive are held over the macro-step, as an engine holds what it is given from outside."""


def mujoco(contact, mass, x, v, drive, h, time, seen, integrator="Euler"):
    """MuJoCo: force as qfrc_applied before each mj_step. Euler there is semi-implicit: it moves by the new speed."""
    import mujoco as mj

    model = mj.MjModel.from_xml_string(f"""
<mujoco>
  <option timestep="{h!r}" gravity="0 0 0" integrator="{integrator}"><flag contact="disable"/></option>
  <worldbody><body><joint name="slide" type="slide" axis="1 0 0"/>
    <inertial pos="0 0 0" mass="{mass!r}" diaginertia="1 1 1"/></body></worldbody>
</mujoco>""")
    data = mj.MjData(model)
    data.qpos[0], data.qvel[0] = x, v
    force = contact.force(x, v, h)
    for i in range(round(time / h)):
        data.qfrc_applied[0] = drive(i * h, x, v) - force
        mj.mj_step(model, data)
        x, v = float(data.qpos[0]), float(data.qvel[0])
        force = contact.force(x, v, h)
        if not seen((i + 1) * h, x, v):
            return


def exudyn(contact, mass, x, v, drive, h, time, seen, solver="GeneralizedAlpha"):
    """Exudyn: force set in the PreStep user function, held by a load over the step. Generalized alpha is implicit: it
    weighs the load with the step before; RK44 takes it as it is."""
    import exudyn as exu
    from exudyn.itemInterface import LoadCoordinate, MarkerNodeCoordinate, Mass1D, Node1D

    container = exu.SystemContainer()
    system = container.AddSystem()
    node = system.AddNode(Node1D(referenceCoordinates=[0.0], initialCoordinates=[x], initialVelocities=[v]))
    system.AddObject(Mass1D(mass=mass, nodeNumber=node))
    marker = system.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
    load = system.AddLoad(LoadCoordinate(markerNumber=marker, load=0.0))
    state = {"over": False}

    def before_step(system, t):
        x = float(system.GetNodeOutput(node, exu.OutputVariableType.Coordinates))
        v = float(system.GetNodeOutput(node, exu.OutputVariableType.Coordinates_t))
        force = contact.force(x, v, h)
        if not seen(t, x, v):
            state["over"] = True
        system.SetLoadParameter(load, "load", drive(t, x, v) - force)
        return not state["over"]

    system.SetPreStepUserFunction(before_step)
    system.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = round(time / h)
    settings.timeIntegration.endTime = time
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    settings.timeIntegration.generalizedAlpha.spectralRadius = 1.0
    system.SolveDynamic(settings, solverType=getattr(exu.DynamicSolverType, solver))


def drake(contact, mass, x, v, drive, h, time, seen, discrete=False):
    """Drake: a LeafSystem around the FMU, its force held by a periodic update, on a prismatic joint of a
    MultibodyPlant; continuous (the integrator is Drake's own) or discrete at the same step."""
    from pydrake.math import RigidTransform
    from pydrake.multibody.plant import MultibodyPlant
    from pydrake.multibody.tree import PrismaticJoint, SpatialInertia, UnitInertia
    from pydrake.systems.analysis import Simulator
    from pydrake.systems.framework import DiagramBuilder, EventStatus, LeafSystem

    class Fmu(LeafSystem):
        def __init__(self):
            super().__init__()
            self.DeclareVectorInputPort("state", 2)
            index = self.DeclareDiscreteState(1)
            self.DeclarePeriodicDiscreteUpdateEvent(h, 0.0, self.step)
            self.DeclareStateOutputPort("force", index)
            self.over = False

        def step(self, context, discrete_state):
            x, v = self.get_input_port().Eval(context)
            force = contact.force(x, v, h)
            self.over = self.over or not seen(context.get_time(), x, v)
            discrete_state.set_value([drive(context.get_time(), x, v) - force])

    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(time_step=h if discrete else 0.0))
    inertia = SpatialInertia(mass, [0.0, 0.0, 0.0], UnitInertia(1.0, 1.0, 1.0))
    body = plant.AddRigidBody("body", inertia)
    joint = plant.AddJoint(
        PrismaticJoint("slide", plant.world_frame(), body.body_frame(), [1.0, 0.0, 0.0])
    )
    plant.AddJointActuator("push", joint)
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
    plant.Finalize()
    fmu = builder.AddSystem(Fmu())
    builder.Connect(plant.get_state_output_port(), fmu.get_input_port())
    builder.Connect(fmu.get_output_port(), plant.get_actuation_input_port())
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.SetPositions(context, [x])
    plant.SetVelocities(context, [v])
    if not discrete:
        simulator.get_mutable_integrator().set_maximum_step_size(h)
        simulator.get_mutable_integrator().request_initial_step_size_target(h)
        simulator.get_mutable_integrator().set_target_accuracy(1e-9)
    simulator.Initialize()
    for i in range(round(time / h)):
        simulator.AdvanceTo((i + 1) * h)
        if fmu.over:
            return
