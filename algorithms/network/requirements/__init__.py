"""What a planner asks of a network as a whole: links, budgets, two ways out.

Each requirement is one class that evaluates designs and writes itself into the models; see
`base.Requirement`. The independent checks are in `network/checks/requirements.py`.
"""
