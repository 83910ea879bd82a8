"""How far the study in a folder is, by what the folder itself says."""

import json
from pathlib import Path

import pytest

from tests.studies.small_study import SMALL
from tuckerl.errors import OutputError, ParameterError
from tuckerl.studies.folder_status import ScenarioStatus, folder_status, identities_of
from tuckerl.studies.planned import file_of
from tuckerl.studies.playing import play_run
from tuckerl.studies.runs import run_identities
from tuckerl.studies.scenarios import scenario_study
from tuckerl.studies.store import Store
from tuckerl.studies.study import Study
from tuckerl.studies.study_differences import seeds_of, study_specification
from tuckerl.studies.study_file import parse_study_file
from tuckerl.studies.study_making import study_of
from tuckerl.studies.workers import Played


@pytest.mark.parametrize("study", [scenario_study(quick=True), study_of(parse_study_file(file_of("dyna-maze")))])
def test_a_folder_knows_the_identities_of_its_runs(study: Study) -> None:
    held = json.loads(json.dumps(study_specification(study) | {"seeds": seeds_of(study)}))
    assert dict(identities_of(held)) == run_identities(study)


def test_what_is_finished_and_failed_is_counted(tmp_path: Path) -> None:
    with Store(tmp_path, SMALL) as store:
        first, second, *_ = store.missing()
        assert folder_status(tmp_path) == [ScenarioStatus("dyna-maze", 2, 60, 0, 0)]
        store.add([Played(first, play_run(SMALL, first)), Played(second, None, "no luck")])
        assert folder_status(tmp_path) == [ScenarioStatus("dyna-maze", 2, 60, 1, 1)]


def test_what_is_no_folder_of_results_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ParameterError, match=r"holds no results: there is no study.json in it"):
        folder_status(tmp_path)
    for content in ("", "[]", "{}", '{"scenarios": {"a": {}}}'):
        (tmp_path / "study.json").write_text(content)
        with pytest.raises(ParameterError, match=r"not one that this version of tuckerl has written: give the command"):
            folder_status(tmp_path)
    (tmp_path / "study.json").unlink()
    (tmp_path / "study.json").mkdir()
    with pytest.raises(OutputError, match="cannot read"):
        folder_status(tmp_path)
