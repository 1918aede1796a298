#pragma once

#include "runtime/solvers/gathering_solver.h"
#include "transfer/exchange/linked_form_factors.h"

namespace rebounce {

/// Hierarchical radiosity (P. Hanrahan, D. Salzman, L. Aupperle, "A rapid hierarchical radiosity
/// algorithm", SIGGRAPH 1991): light is pulled up the tree of patches, gathered at
/// every level along the links and pushed down again, one more bounce per sweep.
///
/// It is Jacobi's method on links: a sweep costs as much as there are links, some n instead of n².
/// The solution is that of the links' F, which differs from the patches' by their error.
class HierarchicalSolver final : public GatheringSolver {
 public:
  HierarchicalSolver(const LinkedFormFactors& links, const RadiosityProblem& problem)
      : GatheringSolver(links, problem) {}
};

}  // namespace rebounce
