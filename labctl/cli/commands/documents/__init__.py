"""Commands that write documents: certificates, data sheets, uncertainty budgets, reproductions of papers."""
