// The text of an IES file, and the profile that it gives.

#include <cmath>

#include "rebounce/error.h"
#include "rebounce/lights.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

constexpr float kPi = 3.14159265F;

void use(const rebounce::IntensityProfile& profile) {
  for (int v = 0; v <= 8; ++v) {
    for (int h = -8; h <= 16; ++h) {
      const float candela =
          profile.intensity(kPi * static_cast<float>(v) / 8, kPi * static_cast<float>(h) / 4);
      rebounce::fuzz::require(candela >= 0, "an intensity is at least 0");
    }
  }
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    use(*rebounce::parse_ies_profile({reinterpret_cast<const char*>(data), size}, "input.ies"));
  } catch (const rebounce::Error& refusal) {
    rebounce::fuzz::require_one_line(refusal.what());
  }
  return 0;
}
