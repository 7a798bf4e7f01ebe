"""Jobs that harm their worker process: lethal, hanging, raising. Run in real worker processes."""

import os
import time
from concurrent.futures import ProcessPoolExecutor

from monitor.identify_window import identify_window
from monitor.workers import local_pool

LETHAL, HANGING = 666, 777  # first_seq of the windows that do it


def run(job):
    if job.window.id.first_seq == LETHAL:
        os.kill(os.getpid(), 9)
    if job.window.id.first_seq == HANGING:
        time.sleep(3600)
    return identify_window(job)


class PoisonPool:
    """The real local pool, with `run` in place of what is submitted."""

    def __init__(self, workers):
        self.pool: ProcessPoolExecutor = local_pool(workers)

    def submit(self, function, *jobs):
        return self.pool.submit(run if jobs else function, *jobs)

    def shutdown(self, **options):
        self.pool.shutdown(**options)

    @property
    def _processes(self):
        return self.pool._processes
