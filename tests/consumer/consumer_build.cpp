// Makes a transfer file of a scene, by the library alone.

#include <cstdio>
#include <exception>

#include "rebounce/build.h"

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  try {
    rebounce::BuildSettings settings;
    settings.subdivision.patch_count = 100;
    settings.store_form_factors = true;  // for the solver of consumer.cpp
    rebounce::BuildReport report;
    const auto data = rebounce::build_transfer(argv[1], settings, report);
    rebounce::save_transfer(argv[2], *data);
    const rebounce::OperatorInfo info = rebounce::operator_info(*rebounce::load_transfer(argv[2]));
    std::printf("%zu patches, a %s operator of %zu bytes\n", report.patch_count,
                rebounce::operator_name(info.kind), info.bytes);
    return info.kind == settings.operator_kind && report.patch_count > 0 ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
