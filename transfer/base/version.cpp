#include "rebounce/version.h"

namespace rebounce {

const char* version() {
  return REBOUNCE_VERSION;
}

}  // namespace rebounce
