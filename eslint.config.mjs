// What `./dev lint` asks of TypeScript beyond its types: names, promises, and imports that say what they are for.
import { defineConfig, globalIgnores } from "eslint/config";
import tseslint from "typescript-eslint";

/** As the ecosystem writes them. */
const names = [
  { selector: "default", format: ["camelCase"], leadingUnderscore: "allow", filter: { regex: "^_$", match: false } },
  { selector: "import", format: ["camelCase", "PascalCase"] },
  { selector: "typeLike", format: ["PascalCase"] },
  { selector: "enumMember", format: ["PascalCase"] },
  // Classes that were picked at run time, and components.
  { selector: "variable", format: ["camelCase", "UPPER_CASE", "PascalCase"], filter: { regex: "^_$", match: false } },
  { selector: "function", format: ["camelCase", "PascalCase"] },
  // Members of Robot Raconteur are written as their definitions have them.
  { selector: "typeProperty", format: ["camelCase", "PascalCase", "UPPER_CASE"] },
  { selector: ["variable", "parameter"], modifiers: ["destructured"], format: null },
  // Keys of literals are data: fields of JSON, headers, names that C++ imports.
  { selector: ["objectLiteralProperty", "objectLiteralMethod"], format: null },
  { selector: "typeProperty", modifiers: ["requiresQuotes"], format: null },
];

export default defineConfig(
  // usage.ts is compiled by a test, with types that are generated then.
  globalIgnores(["**/build/", "**/dist/", "test/wasm-client/types/", "wasm-client/vitest.config.ts"]),
  {
    files: ["wasm-client/**/*.ts", "web/**/*.{ts,tsx}", "test/**/*.ts"],
    extends: [tseslint.configs.recommendedTypeChecked],
    languageOptions: {
      parserOptions: {
        project: [
          "wasm-client/tsconfig.test.json",
          "wasm-client/tsconfig.json",
          "web/tsconfig.json",
          "test/consumers/tsconfig.json",
          "test/e2e/tsconfig.json",
        ],
        tsconfigRootDir: import.meta.dirname,
      },
    },
    linterOptions: { reportUnusedDisableDirectives: "error" },
    rules: {
      "@typescript-eslint/consistent-type-imports": "error",
      "@typescript-eslint/naming-convention": ["error", ...names],
      "@typescript-eslint/no-unused-vars": "off", // the compiler's
      "@typescript-eslint/prefer-promise-reject-errors": [
        "error",
        { allowThrowingAny: true, allowThrowingUnknown: true },
      ], // reasons of signals
      "@typescript-eslint/require-await": "off", // `async` turns what throws into a promise that rejects
      "@typescript-eslint/switch-exhaustiveness-check": ["error", { considerDefaultExhaustiveForUnions: true }],
      "@typescript-eslint/unbound-method": "off", // records of functions are taken apart here
      eqeqeq: "error",
      "no-useless-rename": "error",
      "object-shorthand": ["error", "properties"],
    },
  },
  {
    // Tests look at values of every type, and hand over wrong ones.
    files: ["test/**/*.ts"],
    rules: {
      "@typescript-eslint/await-thenable": "off",
      "@typescript-eslint/no-base-to-string": "off",
      "@typescript-eslint/no-explicit-any": "off",
      "@typescript-eslint/no-this-alias": "off",
      "@typescript-eslint/no-unsafe-assignment": "off",
      "@typescript-eslint/no-unsafe-call": "off",
      "@typescript-eslint/no-unsafe-member-access": "off",
      "@typescript-eslint/no-unsafe-return": "off",
      "@typescript-eslint/prefer-promise-reject-errors": "off",
      "@typescript-eslint/restrict-template-expressions": "off",
    },
  },
);
