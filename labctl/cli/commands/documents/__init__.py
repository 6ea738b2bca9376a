"""Commands that write documents: certificates, performance sheets, uncertainty budgets, reproductions of papers."""
