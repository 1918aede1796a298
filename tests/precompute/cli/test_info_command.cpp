// What `rebounce info` says to people, and what it says to scripts.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/command_line.h"
#include "transfer/file/transfer_file_io.h"

namespace rebounce::test_info_command {
namespace {

using nlohmann::json;
using test::kDone;
using test::kScene;
using test::kScenes;
using test::Outcome;
using test::Words;

class InfoCommand : public test::CommandLine {
 protected:
  std::string said(const std::string& file) {
    const Outcome outcome = run({"info", file});
    EXPECT_EQ(outcome.exit_code, kDone) << outcome.err;
    return outcome.out;
  }
};

TEST_F(InfoCommand, SaysInWordsWhatIsThereAndWhatIsNot) {
  const std::string text = said(built("box.safetensors"));
  for (const char* part : {"cornell_box.gltf, by rebounce ",
                           "bounds      0.556 x 0.549 x 0.559 m, from 0.000, 0.000",
                           "materials   ",
                           "of which emit 1: ",
                           "cameras     1: measured",
                           "lights      none",
                           "operator    hierarchical, q8, ",
                           "to a mean error of 0.5 %",
                           "methods     transfer\n",
                           "light at    patches, vertices",
                           "direct light of one lamp that moves ",
                           " ms, product ",
                           "\n  point         2",
                           "\n  spot ",
                           "\n  patch ",
                           "further lights of a kind",
                           "--store-form-factors  ",
                           "--store-links  ",
                           "--probes 1  ",
                           "--lightmap 1024  ",
                           "--surface-harmonics 512  "}) {
    EXPECT_NE(text.find(part), std::string::npos) << "lacks " << part << " in\n" << text;
  }
}

TEST_F(InfoCommand, NamesNoOptionForWhatIsThere) {
  const std::string text =
      said(built("box.safetensors", {"--store-form-factors", "--store-links", "--probes", "0.2",
                                     "--surface-harmonics", "16"}));
  for (const char* part :
       {"--compress-form-factors", "--store-", "--probes", "--surface-harmonics"}) {
    EXPECT_EQ(text.find(part), std::string::npos) << part << " in\n" << text;
  }
  for (const char* part : {"refine and all iterations, hierarchical; form factors can be exported",
                           " light probes, harmonics for normal maps"}) {
    EXPECT_NE(text.find(part), std::string::npos) << "lacks " << part << " in\n" << text;
  }
}

TEST_F(InfoCommand, ADenseOperatorHasNoTolerance) {
  const std::string file = built("box.safetensors", {"--operator", "dense"});
  EXPECT_NE(said(file).find("exact to rounding"), std::string::npos);
  const json info = summary_of({"info", file});
  EXPECT_EQ(info["tolerance"], 0);
  EXPECT_FALSE(info["settings"].contains("tolerance"));
}

TEST_F(InfoCommand, HasNamesAndBoundsForScripts) {
  json document = json::parse(test::read_bytes(kScene));
  document["meshes"][0]["name"] = "the box";
  const std::string file = path("box.safetensors");
  ASSERT_EQ(run({"precompute", write("box.gltf", document.dump()), "--patches", "100", "--quality",
                 "low", "--quiet", "-o", file})
                .exit_code,
            kDone);
  const json info = summary_of({"info", file});
  EXPECT_EQ(info["cameras"], json({"measured"}));
  EXPECT_EQ(info["materials"].size(), info["material_count"]);
  EXPECT_EQ(info["lights"], json::array());
  EXPECT_NEAR(info["bounds"]["high"][0].get<float>(), 0.556F, 1e-5F);
  EXPECT_NEAR(info["bounds"]["low"][1].get<float>(), 0, 1e-5F);
  const json& meshes = info["report"]["meshes"];
  EXPECT_NE(std::ranges::find(meshes, "the box"), meshes.end()) << meshes;
  EXPECT_EQ(run({"info", file, "--json"}).out, run({"info", file, "--json"}).out)
      << "nothing in it is measured anew";
}

// Other programs may write what they like there.
TEST_F(InfoCommand, TakesAnySettingsAndReport) {
  TransferData data = load_transfer_file(built("box.safetensors"));
  const std::string file = path("other.safetensors");
  for (const char* text :
       {"", "{}", R"({"errors": 1, "meshes": 2, "warnings": 3, "precision": 4})",
        R"({"errors": {"point": 7}, "meshes": [1], "warnings": [{}], "patch_size_median": []})"}) {
    data.settings_json = data.report_json = text;
    save_transfer_file(file, data);
    EXPECT_NE(said(file).find("operator    hierarchical"), std::string::npos) << text;
    EXPECT_EQ(summary_of({"info", file})["patch_count"], data.patches.size()) << text;
  }
}

}  // namespace
}  // namespace rebounce::test_info_command
