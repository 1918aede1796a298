#pragma once

#include <string>
#include <vector>

#include "runtime/solvers/solve_radiosity.h"

namespace rebounce::cli {

/// The product with the operator, without iteration.
inline constexpr const char* kTransferMethod = "transfer";

/// Hierarchical radiosity over the links of the file.
inline constexpr const char* kHierarchicalMethod = "hierarchical";

/// The names that --method accepts.
inline std::vector<std::string> method_names() {
  std::vector<std::string> names = {kTransferMethod};
  for (const NamedSolveMethod& method : kSolveMethods) names.emplace_back(method.name);
  names.emplace_back(kHierarchicalMethod);
  return names;
}

}  // namespace rebounce::cli
