#pragma once

#include "runtime/solvers/gathering_solver.h"
#include "transfer/exchange/linked_form_factors.h"

namespace rebounce {

/// Hierarchical radiosity (P. Hanrahan, D. Salzman, L. Aupperle, "A rapid hierarchical radiosity
/// algorithm", SIGGRAPH 1991). Light is pulled up the tree of patches, gathered at every level
/// along the links, and pushed down again. Each sweep adds one bounce.
///
/// This is Jacobi's method on links. The cost of a sweep is proportional to the number of links,
/// about n instead of n². The solution is that of the links' F; its error is the error of the
/// links.
class HierarchicalSolver final : public GatheringSolver {
 public:
  HierarchicalSolver(const LinkedFormFactors& links, const RadiosityProblem& problem)
      : GatheringSolver(links, problem) {}
};

}  // namespace rebounce
