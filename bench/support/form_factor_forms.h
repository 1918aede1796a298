#pragma once

#include <memory>
#include <string>
#include <vector>

#include "transfer/file/transfer_data.h"

namespace rebounce::bench {

/// A form of F that methods iterate on.
struct Form {
  std::string
      name;  ///< "exact rows", "exact half", "compressed 0.1 %", "shared bases 0.1 %", "links"
  std::shared_ptr<const FormFactorOperator> form_factors;
};

inline constexpr const char *kExactRows = "exact rows", *kExactHalf = "exact half";
inline constexpr const char* kLinks = "links";

/// "0.1 %"
std::string percent(double part);

/// "compressed 0.1 %"
std::string compressed_name(double tolerance);

/// F by all pairs of `data`: rows in blocks, and the half of them that symmetry leaves.
std::vector<Form> exact_forms(const TransferData& data);

/// F along the links of `data`.
Form links_form(const TransferData& data);

/// Compressed F under a name of its own.
Form compressed_form(std::string name, std::shared_ptr<const HierarchicalOperator> compressed);

/// "shared bases 0.1 %"
std::string shared_name(double tolerance);

/// Compressed F whose clusters share their bases, as those of Y do: it gathers and cannot sweep.
Form shared_form(std::string name, std::shared_ptr<const HierarchicalOperator> compressed);

/// Whether Gauss-Seidel can sweep over it.
bool can_sweep(const Form& form);

}  // namespace rebounce::bench
