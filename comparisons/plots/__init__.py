"""Pictures of runs and studies: what `cgla_graph.plots` draws of them, costs against time, and fronts."""
