from labctl.fitting.uncertainty.budget import Budget as Budget, BudgetLine as BudgetLine
from labctl.fitting.uncertainty.coefficient_budget import (
    coefficient_budgets as coefficient_budgets,
    response_budgets as response_budgets,
)
from labctl.fitting.uncertainty.conditions import BenchConditions as BenchConditions, conditions_of as conditions_of
from labctl.fitting.uncertainty.rate import (
    COVERAGE as COVERAGE,
    RateUncertainty as RateUncertainty,
    of_budget as of_budget,
    rate_uncertainty as rate_uncertainty,
)
from labctl.fitting.uncertainty.rate_vector import (
    RateVectorUncertainty as RateVectorUncertainty,
    rate_vector_uncertainty as rate_vector_uncertainty,
)
from labctl.fitting.uncertainty.use import (
    AxisEvidence as AxisEvidence,
    evidence_of as evidence_of,
    use_evidence as use_evidence,
)
