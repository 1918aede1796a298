#include "rebounce/operators.h"

#include <algorithm>
#include <span>

#include "rebounce/error.h"

namespace rebounce {

const char* operator_name(OperatorKind kind) {
  const std::span kinds(kOperatorKinds);
  const auto named = std::ranges::find(kinds, kind, &NamedOperatorKind::kind);
  return named == kinds.end() ? "none" : named->name;
}

OperatorKind operator_kind(std::string_view name) {
  const std::span kinds(kOperatorKinds);
  const auto named = std::ranges::find(kinds, name, &NamedOperatorKind::name);
  if (named == kinds.end()) {
    std::string names;
    for (const NamedOperatorKind& known : kinds) {
      names += (names.empty() ? "" : ", ") + std::string(known.name);
    }
    throw Error("the kind of an operator must be one of " + names + ", not \"" + std::string(name) +
                "\"");
  }
  return named->kind;
}

}  // namespace rebounce
