#include "rebounce/operators.h"

#include <algorithm>

#include "rebounce/error.h"

namespace rebounce {

const char* operator_name(OperatorKind kind) {
  const auto* const named = std::ranges::find(kOperatorKinds, kind, &NamedOperatorKind::kind);
  return named == kOperatorKinds.end() ? "none" : named->name;
}

OperatorKind operator_kind(std::string_view name) {
  const auto* const named = std::ranges::find(kOperatorKinds, name, &NamedOperatorKind::name);
  if (named == kOperatorKinds.end()) {
    throw Error("there is no operator of the kind \"" + std::string(name) + "\"");
  }
  return named->kind;
}

}  // namespace rebounce
