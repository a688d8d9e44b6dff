// A test that expected nothing of the page can't fail: it ends the run with a failure, and is named.
import type { FullResult, Reporter, TestCase, TestResult, TestStep } from "@playwright/test/reporter";

const expects = (step: TestStep): boolean => step.category === "expect" || step.steps.some(expects);

export default class AssertionsReporter implements Reporter {
  private readonly idle: string[] = [];

  onTestEnd(test: TestCase, result: TestResult): void {
    if (result.status === "passed" && !result.steps.some(expects)) this.idle.push(test.titlePath().join(" > "));
  }

  async onEnd(result: FullResult): Promise<{ status: FullResult["status"] }> {
    for (const title of this.idle) console.error(`expected nothing:${title}`);
    return { status: this.idle.length > 0 ? "failed" : result.status };
  }

  printsToStdio(): boolean {
    return false;
  }
}
