#include "transfer/exchange/form_factor_operator.h"

#include "transfer/base/argument_check.h"

namespace rebounce {

void FormFactorOperator::gather(std::span<const Float3> in, std::span<Float3> out,
                                std::span<float> workspace, const Scheduler& scheduler) const {
  check_size("form factors: light to gather", in.size(), patch_count());
  check_size("form factors: gathered light", out.size(), patch_count());
  check_workspace("form factors: workspace", workspace.size(), workspace_size());
  do_gather(in, out, workspace, scheduler);
}

std::vector<Float3> gather(const FormFactorOperator& form_factors, std::span<const Float3> in) {
  std::vector<Float3> out(in.size());
  std::vector<float> workspace(form_factors.workspace_size());
  form_factors.gather(in, out, workspace);
  return out;
}

}  // namespace rebounce
