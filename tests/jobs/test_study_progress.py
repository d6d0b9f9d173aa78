import time

from reacher_shaping.jobs.study_progress import StudyProgress, duration, share_of_log, tell

JOBS = {"long": 3000.0, "short": 1000.0}


def test_before_anything_is_done_the_expected_seconds_are_spread_over_the_cores():
    progress = StudyProgress(JOBS, cores=2, begun=0.0)
    assert progress.line({}, now=0.0) == "0 of 2 jobs, 0% of the work, about 33 min left"


def test_what_was_seen_replaces_what_was_expected():
    """Half the work, 2,000 s, took 1,000 s: the other half takes as long, whatever the cores."""
    progress = StudyProgress(JOBS, cores=64, begun=100.0)
    line = progress.line({"short": 1.0, "long": 1000 / 3000}, now=1100.0)
    assert line == "1 of 2 jobs, 50% of the work, about 17 min left"


def test_a_finished_study_has_nothing_left():
    progress = StudyProgress(JOBS, cores=2, begun=0.0)
    assert progress.line({"short": 1.0, "long": 1.0}, now=500.0) == "2 of 2 jobs, 100% of the work, about 0 s left"


def test_durations_are_in_the_units_that_matter():
    told = [duration(seconds) for seconds in (40, 89.6, 750, 12_000, 190_000)]
    assert told == ["40 s", "90 s", "12 min", "3 h 20 min", "2 d 4 h"]


def test_share_of_a_training_is_its_logs_last_word_and_whole_only_at_the_jobs_end(tmp_path):
    log = tmp_path / "train.log"
    assert share_of_log(log) == 0.0
    log.write_text("goes on from iteration 10 of 40\n")
    assert share_of_log(log) == 0.0
    log.write_text("iteration 10/40, 9 steps/s, 1.0 min left\niteration 30/40, 9 steps/s, 0.3 min left\n")
    assert share_of_log(log) == 0.75
    log.write_text("iteration 40/40, 9 steps/s, 0.0 min left\n")
    assert share_of_log(log) == 0.99


def test_line_is_said_again_and_again_until_it_is_ended():
    lines = []
    end = tell(StudyProgress(JOBS, cores=1), dict, lines.append, seconds_per_line=0.01)
    stop = time.monotonic() + 30
    while len(lines) < 2 and time.monotonic() < stop:
        time.sleep(0.01)
    end()
    assert len(lines) >= 2
    assert lines[0] == "0 of 2 jobs, 0% of the work, about 67 min left".replace("67 min", "1 h 7 min")
