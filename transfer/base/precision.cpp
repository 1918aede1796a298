#include "transfer/base/precision.h"

namespace rebounce {

std::string precision_name(Precision precision) {
  switch (precision) {
    case Precision::kF16:
      return "f16";
    case Precision::kQ16:
      return "q16";
    case Precision::kQ8:
      return "q8";
    case Precision::kF32:
      break;
  }
  return "f32";
}

}  // namespace rebounce
