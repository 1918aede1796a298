#include "transfer/base/precision.h"

#include <algorithm>
#include <span>
#include <string_view>

#include "rebounce/error.h"

namespace rebounce {
namespace {

const OfferedPrecision& offered(Precision precision) {
  return *std::ranges::find(kOfferedPrecisions, precision, &OfferedPrecision::precision);
}

auto find(const HierarchicalPrecision& precision) {
  return std::ranges::find(kOfferedPrecisions, precision, &OfferedPrecision::hierarchical);
}

}  // namespace

HierarchicalPrecision hierarchical_precision(Precision precision) {
  return offered(precision).hierarchical;
}

bool is_offered(const HierarchicalPrecision& precision) {
  return find(precision) != kOfferedPrecisions.end();
}

std::string precision_name(Precision precision) {
  return offered(precision).name;
}

Precision precision_named(std::string_view name) {
  const std::span offers(kOfferedPrecisions);
  const auto named = std::ranges::find(offers, name, &OfferedPrecision::name);
  if (named == offers.end()) {
    throw Error("there is no precision \"" + std::string(name) + "\"");
  }
  return named->precision;
}

std::string precision_name(const HierarchicalPrecision& precision) {
  return find(precision)->name;
}

}  // namespace rebounce
