import gymnasium
import numpy as np
import pytest
from stable_baselines3.common.monitor import Monitor

from reacher_shaping.evaluation import controllers, episode_lengths
from reacher_shaping.evaluation.evaluate import Conditions, evaluate
from reacher_shaping.random_streams import Purpose, stream
from reacher_shaping.settings.cell import Environment
from reacher_shaping.tasks.reacher import draw_reset

SETTINGS = {"success_radius": 0.02, "environment": Environment(control_weight=1.0), "root_seed": 3}


def targets(count):
    """Targets [count, 2] spread evenly over the ring that the arm can reach within the elbow's limit."""
    generator = np.random.default_rng(0)
    distance, direction = generator.uniform(0.019, 0.2, count), generator.uniform(-np.pi, np.pi, count)
    return distance[:, None] * np.stack([np.cos(direction), np.sin(direction)], axis=-1)


def test_both_joint_solutions_bring_the_tip_to_the_target_within_the_elbow_limit():
    wanted = targets(500)
    angles = controllers.joint_angles(wanted)
    tip = controllers.tip_position(angles)
    assert np.abs(tip - wanted[:, None]).max() < 1e-12
    assert np.abs(angles[..., 1]).max() <= 3
    assert (angles[:, 0, 1] > 0).all()
    assert (angles[:, 1, 1] < 0).all()


def test_tip_position_is_the_one_mujoco_computes():
    arm = gymnasium.make("Reacher-v5").unwrapped
    for angles in np.random.default_rng(1).uniform(-3, 3, (20, 2)):
        arm.set_state(np.array([*angles, 0.1, 0.1]), np.zeros(4))
        expected = arm.get_body_com("fingertip")[:2]
        assert controllers.tip_position(angles) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("distance", [0.0, 0.01, 0.3])
def test_unreachable_target_is_approached_as_far_as_the_arm_allows(distance):
    tip = controllers.tip_position(controllers.joint_angles(np.array([0.0, distance])))
    nearest = 0.21 if distance > 0.21 else np.sqrt(0.0221 + 0.022 * np.cos(controllers.ELBOW_LIMIT))
    assert np.hypot(*tip.T) == pytest.approx(nearest)
    if distance:
        assert np.linalg.norm(tip - [0, distance], axis=-1) == pytest.approx(abs(nearest - distance))


@pytest.mark.parametrize("weight", [0.1, 1.0])
def test_reach_succeeds_always_and_beats_doing_nothing(weight):
    settings = SETTINGS | {"environment": Environment(control_weight=weight), "mode": "deterministic", "episodes": 40}
    frame = evaluate(controllers.reach(controllers.TUNED_GAINS[weight]), [0], Conditions(**settings))
    idle = evaluate(controllers.still(2), [0], Conditions(**settings))
    assert frame["final_success"].all()
    assert frame["episode_return"].mean() > idle["episode_return"].mean() + 5


def test_gains_are_at_a_local_optimum_for_their_control_weight():
    def mean_return(weight, gains):
        settings = SETTINGS | {
            "environment": Environment(control_weight=weight),
            "mode": "deterministic",
            "episodes": 40,
        }
        return evaluate(controllers.reach(gains), [0], Conditions(**settings))["episode_return"].mean()

    heavy, light = controllers.TUNED_GAINS[1.0], controllers.TUNED_GAINS[0.1]
    assert mean_return(1.0, heavy) > mean_return(1.0, light)
    assert mean_return(0.1, light) > mean_return(0.1, heavy)


def test_evaluation_of_a_controller_equals_stepping_gymnasium_under_monitor():
    episodes = 3
    frame = evaluate(controllers.gaussian, [0], Conditions(episodes=episodes, **SETTINGS))
    environment = Monitor(gymnasium.make("Reacher-v5", reward_control_weight=1.0))
    resets, noise = stream(3, Purpose.EVALUATION_RESETS), stream(3, Purpose.EVALUATION_ACTIONS)
    for row in frame.itertuples():
        environment.reset(seed=0)
        environment.unwrapped.set_state(*np.split(draw_reset(resets), 2))
        truncated = False
        while not truncated:
            observation, _, _, truncated, info = environment.step(noise.standard_normal(2, dtype=np.float32))
        assert info["episode"]["r"] == pytest.approx(row.episode_return, abs=1e-5)
        assert info["episode"]["l"] == 50
        assert np.linalg.norm(observation[8:10]) == pytest.approx(row.final_distance, abs=1e-12)


def test_random_torques_have_their_distributions():
    noise = np.random.default_rng(2).standard_normal((1, 5000, 2), dtype=np.float32)
    observation = np.zeros((1, 5000, 10))
    uniform = controllers.uniform(1.0)(observation, noise)
    clipped = controllers.clipped_gaussian(1.0)(observation, noise)
    assert np.abs(controllers.uniform(2.0)(observation, noise)).max() > 1.9
    assert np.quantile(uniform, [0, 0.25, 0.5, 0.75, 1]) == pytest.approx([-1, -0.5, 0, 0.5, 1], abs=0.03)
    assert np.abs(clipped).max() == 1
    assert (clipped == noise)[np.abs(noise) < 1].all()


def test_random_policy_without_noise_is_refused():
    with pytest.raises(ValueError, match="needs noise"):
        controllers.uniform(1.0)(np.zeros((1, 1, 10)), None)


def test_controllers_table_has_a_row_each_with_intervals_around_the_means():
    frame = controllers.evaluate_controllers(Conditions(episodes=20, **SETTINGS)).set_index("controller")
    assert len(frame) == 6
    assert (frame["mean_return_low"] <= frame["mean_return"]).all()
    assert (frame["mean_return"] <= frame["mean_return_high"]).all()
    assert frame["success_rate"].between(frame["success_low"], frame["success_high"]).all()
    parts = frame["reward_distance"] + frame["reward_control"]
    assert parts.to_numpy() == pytest.approx(frame["mean_return"].to_numpy())
    assert frame.loc["zero action", "reward_control"] == 0
    assert frame.loc["inverse kinematics + PD", "success_rate"] == 1
    gaussian, clipped = frame.loc["unit Gaussian"], frame.loc["unit Gaussian, clipped"]
    assert gaussian["reward_distance"] == clipped["reward_distance"]  # the actuators clamp: only the cost differs
    assert gaussian["reward_control"] == pytest.approx(-100, rel=0.1)  # 50 steps x 2 torques x variance 1


def test_long_episodes_start_with_the_studys_own_and_hold_their_measures():
    reach = controllers.reach(controllers.TUNED_GAINS[1.0])
    settings = SETTINGS | {"mode": "deterministic", "episodes": 5}
    frame = episode_lengths.evaluate_lengths(lambda o, n: reach(o, n), [4, 7], Conditions(**settings), (50, 100))
    own = evaluate(reach, [4], Conditions(**settings))
    assert frame[["seed", "steps"]].to_numpy().tolist() == [[4, 50], [4, 100], [7, 50], [7, 100]]
    first = frame.iloc[0]
    assert first["return_per_step"] * 50 == pytest.approx(own["episode_return"].mean())
    assert first["final_distance"] == pytest.approx(own["final_distance"].mean())
    assert (frame["final_success_rate"] == 1).all()
    assert first["share_within_radius"] == pytest.approx(share_by_gymnasium(reach, episodes=5))


def share_by_gymnasium(act, episodes):
    """Share of steps within the radius on the study's evaluation resets, stepping Gymnasium itself."""
    env = gymnasium.make("Reacher-v5")
    env.reset()
    env.unwrapped.np_random = stream(SETTINGS["root_seed"], Purpose.EVALUATION_RESETS)
    within = []
    for _ in range(episodes):
        state, truncated = env.reset()[0], False
        while not truncated:
            state, _, _, truncated, info = env.step(act(state[None, None], None)[0, 0])
            within.append(-info["reward_dist"] <= SETTINGS["success_radius"])
    return np.mean(within)


def test_share_within_radius_counts_every_step_and_no_reset():
    frame = episode_lengths.evaluate_lengths(
        controllers.still(2),
        [0],
        Conditions(mode="deterministic", episodes=7, **SETTINGS | {"success_radius": 10.0}),
        (10,),
    )
    assert frame["share_within_radius"].item() == 1
