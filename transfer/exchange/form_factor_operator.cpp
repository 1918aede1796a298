#include "transfer/exchange/form_factor_operator.h"

namespace rebounce {

std::vector<Float3> gather(const FormFactorOperator& form_factors, std::span<const Float3> in) {
  std::vector<Float3> out(in.size());
  std::vector<float> workspace(form_factors.workspace_size());
  form_factors.gather(in, out, workspace);
  return out;
}

}  // namespace rebounce
