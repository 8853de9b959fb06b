"""Makes the bundle, its trajectories in shards, and a learned part, on a Ray cluster with a shared file system."""

import argparse
import json
import subprocess

import ray

FOLDER = json.loads(r""" @FOLDER@ """)
MAKE = json.loads(r""" @MAKE@ """)
SIMULATE = json.loads(r""" @SIMULATE@ """)
TRAIN = json.loads(r""" @TRAIN@ """)
CORES, SHARDS, CASES = json.loads("[@CORES@, @SHARDS@, @CASES@]")


@ray.remote
def run(command):
    subprocess.run(command, check=True, cwd=FOLDER)
    return ray.get_runtime_context().get_worker_id()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cores", type=int, default=CORES, help="of a task")
    parser.add_argument("--shards", type=int, default=SHARDS, help="tasks that simulate")
    parser.add_argument("--cases", type=int, default=CASES, help="trajectories")
    parser.add_argument("--stages", nargs="+", default=["make", "data", "train"], choices=["make", "data", "train"])
    options = parser.parse_args()
    ray.init(ignore_reinit_error=True)
    task = run.options(num_cpus=options.cores)
    simulate = [*SIMULATE, "--count", str(options.cases), "--jobs", str(options.cores)]
    if "make" in options.stages:
        ray.get(task.remote(MAKE))
    if "data" in options.stages:
        parts = [task.remote([*simulate, "--shard", f"{i}/{options.shards}"]) for i in range(options.shards)]
        print(f"{len(set(ray.get(parts)))} workers simulated {options.shards} shards")
        # All shards are there: this only writes the index of the whole.
        ray.get(task.remote(simulate))
    if "train" in options.stages:
        ray.get(task.remote(TRAIN))


if __name__ == "__main__":
    main()
