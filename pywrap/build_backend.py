"""What pip calls: setuptools, with the setup.py of this folder in place of one at the top."""

from setuptools import build_meta
from setuptools.build_meta import *  # noqa: F403


class _Backend(build_meta._BuildMetaBackend):
    def run_setup(self, setup_script: str = "setup.py") -> None:
        super().run_setup(f"pywrap/{setup_script}")


_backend = _Backend()
for _name in ("get_requires_for_build_wheel", "get_requires_for_build_sdist",
              "get_requires_for_build_editable", "prepare_metadata_for_build_wheel",
              "prepare_metadata_for_build_editable", "build_wheel", "build_sdist",
              "build_editable"):
    globals()[_name] = getattr(_backend, _name)
