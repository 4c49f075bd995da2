"""What measures the testbed: each benchmark a folder, all of them on one harness; nothing outside
needs them.

A new one is a folder with a `benchmark.py`: a frozen dataclass of its options that extends
`harness.Benchmark` and says its cases, what one case does, how the answers are summed up, the
tables and, in a template beside it, the page; and a command of three lines in cli/benchmarks.py.
"""
