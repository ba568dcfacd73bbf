from cgla_graph.comparisons.claims.own_run import claims_on as claims_on
from cgla_graph.comparisons.conformance.run import conform as conform
from cgla_graph.comparisons.leaderboard.leaderboard import leaderboard_of
from cgla_graph.comparisons.leaderboard.performance import performances as performances
from cgla_graph.comparisons.results.study_run import write_study as write_study
from cgla_graph.comparisons.study.comparing_in_time import compare_in_time as compare_in_time
from cgla_graph.comparisons.study.entrant import Entrant as Entrant
from cgla_graph.comparisons.study.execution import run_study as run_study
from cgla_graph.comparisons.study.metric import Metric as Metric
from cgla_graph.comparisons.study.metric import metric as metric
from cgla_graph.comparisons.study.rows import rows_of as rows_of
from cgla_graph.comparisons.study.rows import summaries as summaries
from cgla_graph.comparisons.study.runner import Run as Run
from cgla_graph.comparisons.study.runner import compare as compare
from cgla_graph.comparisons.study.store import load as load
from cgla_graph.comparisons.study.study import Study as Study
from cgla_graph.scenarios.graphs.graph_scenario import GraphScenario as GraphScenario
from cgla_graph.scenarios.graphs.graph_scenario import graph_pairs as graph_pairs

Contender = Entrant
standings = leaderboard_of
