"""The benchmark problems with their order and index in exact arithmetic, and those that have neither."""

from support import benchmark_circuits as circuits
from support import benchmark_mechanisms as mechanisms
from support import benchmark_problems as problems
from support.benchmark_problems import Problem

REGULAR: tuple[tuple[Problem, int, int], ...] = (  # order and index
    (problems.mobile_manipulator, 2, 3),
    (problems.spring_dashpot, 12, 0),
    (problems.qep_with_one_infinite_eigenvalue, 5, 0),
    (problems.qep_with_two_infinite_eigenvalues, 4, 1),
    (problems.qep_with_nearby_eigenvalues, 5, 0),
    (problems.bilby, 7, 1),
    (problems.intersection, 4, 3),
    (mechanisms.mass_spring_with_bar, 14, 3),
    (mechanisms.triple_chain, 14, 3),
    (mechanisms.triple_chain_by_means, 14, 3),
    (mechanisms.car_and_pendulum, 4, 3),
    (mechanisms.servo_constraint, 0, 5),
    (mechanisms.damped_servo_constraint, 1, 4),
    (mechanisms.sleigh, 3, 2),
    (mechanisms.slider_crank, 2, 3),
    (mechanisms.loaded_slider_crank, 2, 3),
    (mechanisms.seven_body_mechanism, 2, 3),
    (mechanisms.gear_train, 10, 3),
    (mechanisms.gear_train_with_massless_gears, 7, 2),
    (mechanisms.rigid_link, 2, 3),
    (mechanisms.stiff_link, 4, 0),
    (circuits.rotating_masses, 1, 2),
    (circuits.rl_network, 0, 2),
    (circuits.generator, 1, 3),
    (circuits.stokes, 4, 2),
    (circuits.rlc_loop, 2, 3),
    (circuits.inertia_track_mount, 4, 1),
    (circuits.inertia_track_mount_with_flow, 5, 0),
    (circuits.rigid_mount, 2, 3),
    (circuits.two_track_mount, 4, 2),
    (circuits.beam_with_massless_rotations, 10, 1),
    (circuits.beam_with_few_masses, 4, 1),
    (circuits.hinged_beam, 6, 3),
    (circuits.rotor_in_massless_bearings, 12, 0),
    (circuits.rotor_in_rigid_bearing, 10, 2),
)
SINGULAR: tuple[Problem, ...] = (
    problems.qep_without_regularity,
    mechanisms.redundant_parallelogram,
    circuits.closed_stokes,
)
